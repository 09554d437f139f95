"""What all programs of this project have in common: command line, messages, progress, signals, pages."""
