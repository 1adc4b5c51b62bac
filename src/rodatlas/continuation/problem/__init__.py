"""The continuous problem: what the user writes, its symmetries, and its compiled derivatives."""
