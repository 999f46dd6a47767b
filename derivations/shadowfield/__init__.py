"""Shadow light fields: E11 §3-4 and its appendices, D05 §3.4."""
