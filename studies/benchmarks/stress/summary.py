"""Section of this benchmark on RESULTS.md."""

from stressed.page import TITLE, text

__all__ = ["TITLE", "text"]
