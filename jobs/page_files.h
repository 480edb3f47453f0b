// SPDX-License-Identifier: MIT
#pragma once

// What a page of many scans shows of one: `--thumbnail` and `--viewer`.

#include <cstddef>

#include "jobs/job_context.h"
#include "jobs/quad_finisher.h"

namespace rattan {

/// Writes the thumbnail and the script with the remesh that the options ask for, of the context's
/// remesh, which is the one of options.sizes[size]. With several sizes the files' names (not those
/// of their folders) are expanded like outputs' names. In steps. Throws InputError or ResourceError
/// when they cannot be written.
void write_for_page(JobContext& job, QuadFinisher& finisher, std::size_t size);

}  // namespace rattan
