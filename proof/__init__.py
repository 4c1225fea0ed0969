"""Proof on concealed effects: a builder of cases that a diagnosis cannot know, and a scorer that believes nothing."""
