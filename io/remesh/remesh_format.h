// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace rattan {

enum class RemeshFormat { kDraco, kObj, kPly, kOff };

/// By the extension of `path`, any case. Throws UsageError naming the formats.
RemeshFormat remesh_format(const std::string& path);

}  // namespace rattan
