"""The prose linter: plain technical English in docs and help texts."""
