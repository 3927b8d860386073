#pragma once

#include <ist/asset.h>
#include <ist/shapes.h>

#include "query/base/solid_box.h"

namespace ist {

SolidBox solid_box(const AssetView& asset) noexcept;
SolidBox solid_box(const Shape& shape) noexcept;

}  // namespace ist
