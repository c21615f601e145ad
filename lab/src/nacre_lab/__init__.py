"""The research behind nacre: both papers reproduced, and the open benchmark."""
