"""Where to hold and to draw a real part: the flat faces at the two ends of its longest side, from `flexel info --json`."""

SMALLEST = 0.1  # of the area of the largest face that looks along the side
ALONG = 0.7  # cosine


def end_faces(solid, fit=lambda face: True):
    """The lowest and the highest of the flat faces that look along the longest side of `solid` and fit; of all flat faces that fit where
    there are not two."""
    sides = [high - low for low, high in zip(solid["min"], solid["max"])]
    along = sides.index(max(sides))
    flat = [face for face in solid["faces"] if face["kind"] == "flat" and fit(face)]
    ends = [face for face in flat if abs(face["normal"][along]) > ALONG]
    large = [face for face in ends if face["area"] >= SMALLEST * max(each["area"] for each in ends)]
    faces = large if len({face["centroid"][along] for face in large}) > 1 else flat
    return min(faces, key=lambda face: face["centroid"][along]), max(faces, key=lambda face: face["centroid"][along])
