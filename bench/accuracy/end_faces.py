"""Where to hold and to draw a real part: flat faces at the two ends of its longest side, from `flexel info --json`."""

SMALLEST = 0.1  # of the area of the largest face that looks along the side
ALONG = 0.7  # cosine
APART = 0.25  # of the longest side


def end_faces(solid, fit=lambda face: True):
    """The lowest and the highest of the flat faces that look along the longest side of `solid` and fit; of all flat faces that fit where
    there are not two, or where those are so close that little of the part would be between them."""
    sides = [high - low for low, high in zip(solid["min"], solid["max"])]
    along = sides.index(max(sides))

    def ends(faces):
        least = SMALLEST * max((face["area"] for face in faces), default=0)
        large = [face for face in faces if face["area"] >= least]
        places = [face["centroid"][along] for face in large]
        return large, max(places, default=0) - min(places, default=0)

    flat = [face for face in solid["faces"] if face["kind"] == "flat" and fit(face)]
    faces, apart = ends([face for face in flat if abs(face["normal"][along]) > ALONG])
    if apart < APART * sides[along]:
        faces, _ = ends(flat)
    return min(faces, key=lambda face: face["centroid"][along]), max(faces, key=lambda face: face["centroid"][along])
