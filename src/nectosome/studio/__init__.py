"""The studio: a page in the browser on which a robot swims and answers to sliders."""
