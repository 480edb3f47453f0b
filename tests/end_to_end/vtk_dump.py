# SPDX-License-Identifier: MIT
"""Run by a Python that has VTK: what VTK's own reader makes of a VTKHDF file, as a pickle.

vtk_dump.py FILE.vtkhdf OUT.pickle; without arguments: whether there is VTK."""

import pickle
import sys

from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringArray, vtkStringOutputWindow
from vtkmodules.vtkIOHDF import vtkHDFReader


def values(array):
    if isinstance(array, vtkStringArray):
        return [array.GetValue(i) for i in range(array.GetNumberOfValues())]
    view = memoryview(array)
    return array.GetNumberOfComponents(), view.format, view.tobytes()


def arrays(data):
    return {data.GetArrayName(i): values(data.GetAbstractArray(i))
            for i in range(data.GetNumberOfArrays())}


def main(path, out):
    said = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(said)
    reader = vtkHDFReader()
    assert reader.CanReadFile(path)
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    cells = grid.GetCells()
    result = {"class": grid.GetClassName(), "said": said.GetOutput(),
              "points": values(grid.GetPoints().GetData()),
              "connectivity": values(cells.GetConnectivityArray()),
              "offsets": values(cells.GetOffsetsArray()),
              "types": values(grid.GetCellTypesArray()),
              "point_data": arrays(grid.GetPointData()), "cell_data": arrays(grid.GetCellData()),
              "field_data": arrays(grid.GetFieldData())}
    with open(out, "wb") as file:
        pickle.dump(result, file)


if len(sys.argv) > 1:
    main(*sys.argv[1:])
