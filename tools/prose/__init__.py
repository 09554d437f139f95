"""The prose linter: plain technical English in docs, help texts, docstrings, comments and messages."""
