"""The published-figure ledger: our value beside every published figure, with a verdict."""

from results.ledger.findings import Finding
from results.ledger.judging import evaluate
from results.ledger.rows import VERDICTS, LedgerRow, counts

__all__ = ["VERDICTS", "Finding", "LedgerRow", "counts", "evaluate"]
