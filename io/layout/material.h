// SPDX-License-Identifier: MIT
#pragma once

// Materials of OBJ files (.mtl), as far as colours go.

#include <string>
#include <string_view>
#include <vector>

#include "engine/core/types.h"
#include "io/picture/image.h"

namespace rattan {

struct Material {
  std::string name;
  Rgb colour{255, 255, 255};    ///< Kd
  std::string picture;          ///< path of map_Kd, or empty
  Vec2d scale = Vec2d::Ones();  ///< of texture coordinates, before the offset
  Vec2d offset = Vec2d::Zero();
  std::string file;      ///< path of the .mtl, if it comes from one
  bool clamped = false;  ///< beyond [0, 1] the border's colour; else the picture repeats
};

/// Names in the file are relative to its folder. Throws InputError.
std::vector<Material> read_materials(const std::string& path);

/// `name` as a path seen from the folder of `file`; '\\' stands for '/'.
std::string beside(const std::string& file, std::string_view name);

/// One white, matt material of that name that shows the picture. `picture` is written as it is: a
/// name relative to the file's folder. Complete or absent (AtomicFile).
void write_material(const std::string& path, const std::string& name, const std::string& picture);

}  // namespace rattan
