"""Parts of `tools/reconstruct_sequence.py`."""
