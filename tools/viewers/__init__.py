"""Opens results in the programs people view them with, and measures what those show. `tools/view.py` is the command."""
