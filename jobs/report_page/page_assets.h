// SPDX-License-Identifier: MIT
#pragma once

// The page's own files (page/), put into the program by embed.cmake.

#include <string_view>

namespace rattan::page_assets {

extern const std::string_view kPage;  ///< with marks where the rest goes
extern const std::string_view kStyle;
extern const std::string_view kScript;  ///< all scripts, in their order

}  // namespace rattan::page_assets
