"""Files: whole or absent; tensors, images, arrays and tables of text."""
