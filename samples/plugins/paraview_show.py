"""Shows a body (.vtu) or a series (.pvd) in ParaView, deformed and coloured by a result, and writes a picture.

    pvpython paraview_show.py FILE [RESULT] PICTURE.png      RESULT: von_mises, displacement, ... (default displacement)

Debian's pvpython needs a display to draw: xvfb-run pvpython ... where there is none. In ParaView itself: File > Open; the cells are where the run has moved them. For the shape at rest, Filters > Warp By Vector by
"displacement", with the factor -1.
"""

import sys

from paraview.simple import ColorBy, GetActiveViewOrCreate, OpenDataFile, Render, ResetCamera, SaveScreenshot, Show, UpdatePipeline


def main():
    if not 3 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    body, result, picture = sys.argv[1], sys.argv[2] if len(sys.argv) == 4 else "displacement", sys.argv[-1]
    data = OpenDataFile(body)
    UpdatePipeline(proxy=data)
    known = sorted(data.PointData.keys())
    if result not in known:
        sys.exit(f"{body}: no result \"{result}\" at the elements; there are {', '.join(known)}")
    view = GetActiveViewOrCreate("RenderView")
    view.ViewSize = [1200, 900]
    shown = Show(data, view)
    ColorBy(shown, ("POINTS", result))
    shown.RescaleTransferFunctionToDataRange(True)
    shown.SetScalarBarVisibility(view, True)
    ResetCamera(view)
    Render(view)
    SaveScreenshot(picture, view)
    low, high = data.PointData[result].GetRange(-1)
    print(f"{result}: {low:.6g} to {high:.6g}")


main()
