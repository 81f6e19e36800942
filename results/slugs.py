"""Names of samples, which hold what is swept: ``twist=90deg_corner=lower-left_frequency=5Hz``."""

import re

#: One ``name=value``; names may hold the underscores that part the words.
_WORD = re.compile(r"([A-Za-z]\w*)=([^=]*?)(?=_[A-Za-z]\w*=|$)")


def words(slug: str) -> dict[str, str]:
    """Swept values as text, by name."""
    return dict(_WORD.findall(slug))


def short(slug: str) -> str:
    """The values alone, for tables: ``90deg lower-left 5Hz``; text without names stays as it is."""
    values = _WORD.sub(lambda word: f"{word[2]} ", slug)
    return " ".join(values.replace(" _", " ").split())
