"""The studio: a local web page on which a robot is designed, moved and measured."""
