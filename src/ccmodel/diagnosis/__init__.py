"""Where model and recordings differ, which physics was left out, and how much better it is with it."""
