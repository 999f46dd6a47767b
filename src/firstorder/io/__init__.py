"""Files, written whole or not at all; the only importers of the packages that read them."""

from firstorder.io.records import whole, write_csv, write_json, write_npz, write_text

__all__ = ["whole", "write_csv", "write_json", "write_npz", "write_text"]
