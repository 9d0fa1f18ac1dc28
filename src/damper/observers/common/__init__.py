"""What observers share: their base, their settings, sections, the stretch that one samples."""
