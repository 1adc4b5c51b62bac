"""The band in space: its surface, and its picture."""
