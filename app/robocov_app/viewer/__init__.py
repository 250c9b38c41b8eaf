"""The interactive window: sessions and actions (without pygame), drawing, and input."""
