// SPDX-License-Identifier: MIT
#include "jobs/page_files.h"

#include <filesystem>
#include <string>

#include "engine/core/resident_memory.h"
#include "io/file/atomic_file.h"
#include "io/picture/thumbnail.h"
#include "jobs/output_names.h"
#include "jobs/view_script.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;

/// A folder may be named after a template that isn't meant here.
std::string name_of_size(const std::string& path, const RemeshOptions& options, std::size_t size) {
  const fs::path p(path);
  const std::string name =
      expand_names(p.filename().string(), options.size_kind, options.sizes).at(size);
  return (p.parent_path() / name).string();
}

void write_whole(const std::string& bytes, const std::string& path) {
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

}  // namespace

void write_for_page(JobContext& job, QuadFinisher& finisher, std::size_t size) {
  const RemeshOptions& options = job.options;
  const auto file = [&](const char* step, const std::string& wish, auto bytes_of, auto make) {
    if (wish.empty()) {
      return;
    }
    const std::string path = name_of_size(wish, options, size);
    job.steps.depend_on("");
    job.steps.next_makes(path);
    job.steps.run(step, [&] {
      finisher.release();
      const PromptReturn prompt(job.budget.tight());
      const PolygonMesh& remesh = job.remesh.get();
      const Reservation held = job.budget.reserve(bytes_of(remesh), "pictures of the remesh");
      write_whole(make(remesh), path);
    });
  };
  file(
      "thumbnail", options.thumbnail, [](const PolygonMesh& m) { return thumbnail_bytes(m); },
      [](const PolygonMesh& m) { return draw_thumbnail(m); });
  const std::string name =
      fs::path(expand_names(options.output, options.size_kind, options.sizes).at(size))
          .filename()
          .string();
  file(
      "viewer", options.viewer, [](const PolygonMesh& m) { return view_script_bytes(m); },
      [&](const PolygonMesh& m) { return view_script(m, name); });
}

}  // namespace rattan
