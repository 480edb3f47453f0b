// SPDX-License-Identifier: MIT
#pragma once

// The two texts made of a batch's report, and how names of files are written in them.

#include <functional>
#include <string>
#include <string_view>

#include "jobs/report_page/batch_report.h"

namespace rattan {

/// Takes a text piece by piece.
using TextSink = std::function<void(std::string_view)>;

/// report.json: names in the folder's README. A scan a line.
void write_report_json(const BatchReport& report, const TextSink& sink);

/// report.html, whole: style, script and data are in it.
void write_report_html(const BatchReport& report, const TextSink& sink);

/// A path below the page's folder as a relative link: every byte but letters, digits and -_.~/ as
/// %XX, so also what isn't UTF-8.
std::string link_to(std::string_view path);

}  // namespace rattan
