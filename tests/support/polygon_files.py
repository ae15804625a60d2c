"""Small PLY files with polygons, written number by number."""

import struct

LETTER_C = ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (2, 2), (2, 3), (0, 3))  # area 5 of a box of 6


def write_ply(file, vertices, faces, *, form="ascii", face_colors=(), texcoords=(), comment=""):
    """Write positions (n, 3) and faces of any lengths; colours of faces, or numbers of their corners, beside."""
    header = f"ply\nformat {form} 1.0\n{comment}element vertex {len(vertices)}\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz")
    header += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
    header += "property list uchar float texcoord\n" if texcoords else ""
    header += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue")) if face_colors else ""
    rows = [[("f", value) for value in vertex] for vertex in vertices]
    for index, face in enumerate(faces):
        row = [("B", len(face)), *(("i", corner) for corner in face)]
        if texcoords:
            row += [("B", len(texcoords[index])), *(("f", value) for value in texcoords[index])]
        rows.append(row + [("B", value) for value in (face_colors[index] if face_colors else ())])
    if form == "ascii":
        body = "".join(" ".join(str(value) for _, value in row) + "\n" for row in rows).encode()
    else:
        order = ">" if "big" in form else "<"
        body = b"".join(struct.pack(order + kind, value) for row in rows for kind, value in row)
    file.write_bytes(header.encode() + b"end_header\n" + body)
    return file
