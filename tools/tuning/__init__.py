"""Gain tuning: linear model, margins, gain design, Monte Carlo, checks on the emulator, report."""
