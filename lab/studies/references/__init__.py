"""What others do, written out to compare with: one module each."""
