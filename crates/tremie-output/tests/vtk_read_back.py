"""Reads .vti, .vtp and .pvd files with VTK's own readers and prints what is in them.

    pip install vtk numpy
    cargo run -p tremie-output --example vtk_files -- FOLDER
    python vtk_read_back.py FOLDER/fields.pvd FOLDER/fields_0.vti FOLDER/surface.vtp

Exits with 1 if VTK reports an error or warning, or a file is empty.
With --example, the values are also compared with the formulas in examples/vtk_files.rs.
"""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

READERS = {".vti": vtk.vtkXMLImageDataReader, ".vtp": vtk.vtkXMLPolyDataReader}


class Failure(Exception):
    pass


def read(path):
    """The data set in a file, or Failure with what VTK said."""
    if not path.is_file():
        raise Failure("no such file")
    said = []

    def hear(_object, event, text):
        said.append(f"{event}: {text.strip()}")

    hear.CallDataType = vtk.VTK_STRING
    reader = READERS[path.suffix]()
    for event in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(event, hear)
    reader.SetFileName(str(path))
    if not reader.CanReadFile(str(path)):
        raise Failure("VTK does not recognise the file")
    reader.Update()
    if said or reader.GetErrorCode():
        raise Failure("; ".join(said) or f"error code {reader.GetErrorCode()}")
    return reader.GetOutput()


def arrays(attributes):
    return {
        attributes.GetArrayName(n): vtk_to_numpy(attributes.GetArray(n))
        for n in range(attributes.GetNumberOfArrays())
    }


def show(path):
    """Prints a data set and returns it."""
    data = read(path)
    if data.GetNumberOfPoints() == 0 or data.GetNumberOfCells() == 0:
        raise Failure("no points or no cells")
    bounds = ", ".join(f"{b:g}" for b in data.GetBounds())
    print(f"{path}: {data.GetNumberOfPoints()} points, {data.GetNumberOfCells()} cells, bounds ({bounds})")
    fields = {"cell": data.GetCellData(), "point": data.GetPointData(), "field": data.GetFieldData()}
    for place, attributes in fields.items():
        for name, values in arrays(attributes).items():
            if values.size == 0:
                raise Failure(f"{place} array {name} is empty")
            print(f"    {place} {name!r}: {values.dtype} {values.shape}, {values.min():g} to {values.max():g}")
    if "TimeValue" not in arrays(data.GetFieldData()):
        raise Failure("no TimeValue")
    return data


def show_collection(path):
    """Shows every file of a collection and compares its time."""
    entries = ElementTree.parse(path).getroot().findall("Collection/DataSet")
    if not entries:
        raise Failure("an empty collection")
    for entry in entries:
        data = show(path.parent / entry.get("file"))
        time = arrays(data.GetFieldData())["TimeValue"][0]
        if time != float(entry.get("timestep")):
            raise Failure(f"{entry.get('file')} is of time {time}, not {entry.get('timestep')}")


def compare_with_example(path, data):
    """Compares with the values that examples/vtk_files.rs gives by formula."""

    def agree(what, values, expected, tolerance):
        if not np.allclose(values, expected, rtol=0.0, atol=tolerance):
            raise Failure(f"{what} differs from the formula")

    if path.suffix == ".vti":
        time = arrays(data.GetFieldData())["TimeValue"][0]
        centres = vtk.vtkCellCenters()
        centres.SetInputData(data)
        centres.Update()
        x = vtk_to_numpy(centres.GetOutput().GetPoints().GetData())
        cell = arrays(data.GetCellData())
        agree("pressure", cell["pressure [Pa]"], x @ [1.0, 10.0, 100.0] + 1000.0 * time, 1e-4)
        agree("velocity", cell["velocity [m/s]"], x, 1e-7)
        agree("kind", cell["kind"], np.round((x[:, 2] - 0.1) / 0.005 - 0.5), 0.0)
    else:
        mass = vtk.vtkMassProperties()
        mass.SetInputData(data)
        agree("volume", mass.GetVolume(), 0.001, 1e-9)
        agree("speed", arrays(data.GetPointData())["speed [m/s]"], [1.0, 2.0, 3.0, 4.0], 0.0)


def main(arguments):
    example = "--example" in arguments
    files = [Path(a) for a in arguments if a != "--example"]
    if not files:
        print(__doc__)
        return 2
    failed = False
    for path in files:
        try:
            if path.suffix == ".pvd":
                show_collection(path)
            elif path.suffix in READERS:
                data = show(path)
                if example:
                    compare_with_example(path, data)
            else:
                raise Failure("neither .vti nor .vtp nor .pvd")
        except (Failure, ElementTree.ParseError, OSError) as error:
            print(f"{path}: {error}", file=sys.stderr)
            failed = True
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
