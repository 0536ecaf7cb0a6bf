"""Looks at the caregiver: rendered, recorded, cached on disk."""
