"""Looks at the caregiver: rendered, recorded, kept on disk."""
