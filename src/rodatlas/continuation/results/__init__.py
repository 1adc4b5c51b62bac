"""What a computation gives: branches, loci, special points and what was checked; they compute nothing."""
