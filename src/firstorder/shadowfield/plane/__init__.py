"""Shadow light fields of flatland: spectra, filters, sampling rates."""
