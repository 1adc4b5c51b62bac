"""What all figures share: colors and lines (`style`), words (`heading`, `labels`), places of labels (`placement`), and
what is asked of results (`protocols`)."""
