"""What the papers say about their equations in words: captions, footnotes, terms and signs."""
