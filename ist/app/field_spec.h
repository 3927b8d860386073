#pragma once

#include <ist/shapes.h>
#include <string>

// Fields on the command line, lengths in [u], in the field's own frame:
//   plane:nx,ny,nz,d   the solid n · x ≤ d, n of any length above 0
//   box:hx,hy,hz       half extents
//   ball:r             radius
//   capsule:r,h        radius, half height of its segment, along z
//   cylinder:r,h       radius, half height, along z

namespace ist::app {

/// Whether an argument describes a field and names no file: it begins with a kind and a colon.
bool is_field_spec(const std::string& text);

/// Throws Error that says what of the description is wrong and what is expected.
Shape parse_field(const std::string& text);

}  // namespace ist::app
