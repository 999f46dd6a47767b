"""What figures of one paper share."""
