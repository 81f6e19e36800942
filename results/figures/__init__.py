"""Figures of numbers and curves (matplotlib); each has the data behind it as CSV beside it."""
