"""The table planned while it moves: scan locations become known one after another, each step is decided as it comes."""
