// SPDX-License-Identifier: MIT
#include "jobs/render_job.h"

#include <filesystem>
#include <optional>

#include "engine/core/errors.h"
#include "engine/mesh/scan_record.h"
#include "io/layout/texture_picture.h"
#include "io/picture/textured_picture.h"
#include "io/store/hdf5_store.h"
#include "jobs/load_mesh.h"
#include "jobs/memory_share.h"
#include "jobs/preview.h"
#include "jobs/work_record.h"

namespace rattan {

namespace {

namespace fs = std::filesystem;

void check_output(const std::string& output) {
  const fs::path path(output);
  const std::string extension = path.extension().string();
  if (extension != ".png" && extension != ".PNG") {
    throw UsageError(output + ": pictures are written as PNG. Use a name that ends in .png.");
  }
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    throw UsageError(folder.string() + ": there is no such folder to write " + output +
                     " into. Create it first.");
  }
}

RenderOptions render_options(const PictureOptions& options) {
  RenderOptions how;
  how.width = options.width;
  how.height = options.height;
  how.view = options.view;
  return how;
}

void render_work(const PictureOptions& options) {
  Hdf5Store store({.directory = options.path,
                   .cache_bytes = default_memory_share() / 2,
                   .keep = true,
                   .read_only = true});
  if (!store.has_chunk(fields::kScanRecord.name, TileId(0))) {
    throw InputError(options.path, "", "the folder holds no scan of Rattan's",
                     "Give the work directory of a run with --keep-work");
  }
  const ScanMesh scan = load_scan_mesh(store);
  const WorkRecord work = load_work(store);
  write_preview({.store = store,
                 .scan = scan,
                 .remesh = work.remesh ? &*work.remesh : nullptr,
                 .charts = work.charts ? &work.charts->layout : nullptr,
                 .flat = work.charts ? &work.charts->flat : nullptr,
                 .omega = work.omega,
                 .density = work.density},
                options.output, render_options(options));
}

void render_file(const PictureOptions& options) {
  const LoadedMesh loaded = load_mesh(options.path);
  write_png(render_polygons(loaded.mesh, render_options(options), nullptr, options.edges),
            options.output);
}

void render_texture(const PictureOptions& options) {
  RenderOptions how = render_options(options);
  std::optional<PictureTexture> texture;
  if (options.texture != kCheckerboard) {
    how.texture = &texture.emplace(read_picture(options.texture));
  }
  const TexturedSurface surface = read_textured_surface(options.path);
  write_png(render_textured(surface, how,
                            options.checks > 0.0 ? std::optional(options.checks) : std::nullopt,
                            options.edges),
            options.output);
}

}  // namespace

void render_picture(const PictureOptions& options) {
  check_output(options.output);
  if (fs::is_directory(options.path)) {
    if (!options.texture.empty()) {
      throw UsageError(options.path +
                       ": textures are shown on files. Give the layout that the run wrote.");
    }
    render_work(options);
  } else if (!options.texture.empty()) {
    render_texture(options);
  } else {
    render_file(options);
  }
}

}  // namespace rattan
