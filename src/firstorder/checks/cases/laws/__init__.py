"""Cases of the laws."""
