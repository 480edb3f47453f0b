// SPDX-License-Identifier: MIT
#include "tools/rattan/batch_selection.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <sys/stat.h>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "engine/core/errors.h"
#include "jobs/batch/collect.h"
#include "jobs/batch/manifest.h"
#include "jobs/batch/output_template.h"

namespace rattan {

namespace {

namespace fs = std::filesystem;

std::string absolute(const std::string& path) {
  std::string text = fs::absolute(path).lexically_normal().string();
  while (text.size() > 1 && text.ends_with('/')) {
    text.pop_back();
  }
  return text;
}

// The folder of a path as written, without what leads upwards or to the root: what {dir} can be for
// a scan that no folder was searched for.
std::string folder_as_written(const std::string& path) {
  const fs::path written = fs::path(path).lexically_normal();
  if (written.is_absolute()) {
    return "";
  }
  fs::path folder;
  for (const fs::path& part : written.parent_path()) {
    if (part != ".." && part != ".") {
      folder /= part;
    }
  }
  return folder.string();
}

class Selector {
 public:
  Selector(const BatchSelection& selection, const std::function<void(const std::string&)>& warn)
      : selection_(selection),
        warn_(warn),
        filter_(selection.include, selection.exclude),
        template_(template_text(selection)),
        directory_(selection.directory.empty() ? "" : absolute(selection.directory)),
        base_(selection.remesh.resolve()) {
    make_absolute(base_, fs::current_path().string());
  }

  std::vector<BatchItem> run() {
    if (selection_.paths.empty()) {
      throw UsageError(
          "No scans were named. Name files, folders, or manifests (.csv, .jsonl), e.g. rattan "
          "batch "
          "scans -o remeshes.");
    }
    check_directory();
    // Rows first: a scan that has one isn't taken again from a folder.
    for (const std::string& path : selection_.paths) {
      if (is_manifest(path)) {
        manifest(path);
      }
    }
    for (const std::string& path : selection_.paths) {
      if (!is_manifest(path)) {
        fs::is_directory(path) ? folder(path) : file(path);
      }
    }
    if (items_.empty()) {
      refuse_nothing();
    }
    named_ = {};  // a hundred bytes a scan
    std::sort(items_.begin(), items_.end(), [](const BatchItem& a, const BatchItem& b) {
      return a.id != b.id ? a.id < b.id : a.scan < b.scan;
    });
    check_outputs(items_, directory_);
    check_own_files();
    items_.shrink_to_fit();
    return std::move(items_);
  }

 private:
  static std::string template_text(const BatchSelection& selection) {
    const std::string format = selection.format.empty() ? "drc" : selection.format;
    if (selection.name.empty()) {
      return "{dir}/{stem}." + format;
    }
    const std::string extension = fs::path(selection.name).extension().string();
    if (extension.empty() || extension.find('}') != std::string::npos) {
      return selection.name + "." + format;
    }
    if (!selection.format.empty() && extension != "." + selection.format) {
      throw UsageError(
          fmt::format("--name {} ends in {}, and --format says {}. Leave one of them out.",
                      selection.name, extension, selection.format));
    }
    return selection.name;
  }

  static bool is_manifest(const std::string& path) {
    return is_manifest_name(path) && !fs::is_directory(path);
  }

  static void check_exists(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) {
      throw UsageError(path + ": there is no such file or folder. Check the path.");
    }
  }

  void check_directory() const {
    if (!directory_.empty() && fs::exists(directory_) && !fs::is_directory(directory_)) {
      throw UsageError(directory_ +
                       ": this is no folder, and the remeshes go into one. Name another with -o.");
    }
  }

  void add(FoundScan&& scan, const ScanPlace& place, std::shared_ptr<const ItemOptions> what,
           const std::string& output, double cost, const std::string& where) {
    BatchItem item;
    item.id = checked_output(output.empty() ? template_(place) : output,
                             where.empty() ? scan.path : where);
    item.scan = std::move(scan.path);
    item.what = std::move(what);
    item.scan_bytes = scan.stamp.bytes;
    item.scan_time = scan.stamp.time;
    item.cost = cost;
    items_.push_back(std::move(item));
  }

  void manifest(const std::string& path) {
    check_exists(path);
    const std::string here = fs::path(absolute(path)).parent_path().string();
    read_manifest(path, parser_.columns(), [&](ManifestRow&& row) {
      if (!filter_.takes(row.path)) {
        return;
      }
      FoundScan scan;
      scan.path = absolute((fs::path(here) / row.path).string());
      scan.stamp = FileStamp::of(scan.path);
      named_.insert(scan.path);
      const fs::path real(scan.path);
      const ScanPlace place{real.parent_path().filename().string(), folder_as_written(row.path),
                            real.filename().string()};
      add(std::move(scan), place, options_of(row, here), row.output, row.cost, row.place);
    });
  }

  std::shared_ptr<const ItemOptions> options_of(const ManifestRow& row, const std::string& here) {
    if (row.options.empty()) {
      return shared(base_);
    }
    std::string same = here;
    for (const auto& [column, value] : row.options) {
      same.append(1, '\n').append(column).append(1, '=').append(value);
    }
    std::shared_ptr<const ItemOptions>& known = rows_[same];
    if (!known) {
      known = shared(parser_.parse(base_, row.options, here, row.place));
    }
    return known;
  }

  std::shared_ptr<const ItemOptions> shared(const RemeshOptions& options) {
    std::vector<std::string> words = option_words(options);
    std::shared_ptr<const ItemOptions>& known = by_words_[words];
    if (!known) {
      ItemOptions made;
      made.key = item_key(options);
      made.remesh = options;
      made.words = std::move(words);
      known = std::make_shared<const ItemOptions>(std::move(made));
    }
    return known;
  }

  void folder(const std::string& path) {
    const std::string root = absolute(path);
    const ScanPlace base{fs::path(root).filename().string(), "", ""};
    const auto what = shared(base_);
    const std::size_t before = items_.size();
    walk_scans(root, {filter_, directory_}, [&](FoundScan&& scan) {
      if (!named_.insert(scan.path).second) {
        return;
      }
      ScanPlace place = base;
      const std::size_t slash = scan.relative.rfind('/');
      place.folder = slash == std::string::npos ? "" : scan.relative.substr(0, slash);
      place.file_name =
          slash == std::string::npos ? scan.relative : scan.relative.substr(slash + 1);
      add(std::move(scan), place, what, "", 0.0, "");
    });
    if (items_.size() == before) {
      empty_.push_back(path);
    }
    roots_.push_back(root);
  }

  void file(const std::string& path) {
    if (!has_scan_extension(path)) {
      check_exists(path);
    }
    FoundScan scan;
    scan.path = absolute(path);
    scan.stamp = FileStamp::of(scan.path);
    const fs::path real(scan.path);
    if (!filter_.takes(path) || !named_.insert(scan.path).second) {
      return;
    }
    const ScanPlace place{real.parent_path().filename().string(), "", real.filename().string()};
    add(std::move(scan), place, shared(base_), "", 0.0, "");
  }

  [[noreturn]] void refuse_nothing() const {
    const std::string where = fmt::format("{}", fmt::join(selection_.paths, ", "));
    if (!selection_.include.empty() || !selection_.exclude.empty()) {
      throw UsageError(
          where +
          ": --include and --exclude leave no scan. A pattern without / is about names, "
          "one with / about paths below the folder.");
    }
    throw UsageError(fmt::format(
        "{}: there are no scans here. Files in folders are taken by extension ({}), hidden ones "
        "left out.",
        where, kScanExtensions));
  }

  // What the next run would find: outputs that lie in a folder that is searched, where the folder
  // of the outputs isn't left out as a whole because it contains that folder.
  void check_not_found_again() const;

  // Files that an item has for itself, besides its outputs.
  void check_own_files() const {
    for (const std::string& empty : empty_) {
      warn_(fmt::format("{}: no scans are taken from this folder.", empty));
    }
    check_not_found_again();
    std::map<std::string, const BatchItem*> taken;
    for (const BatchItem& item : items_) {
      for (const std::string* path : {&item.what->remesh.work_dir, &item.what->remesh.preview}) {
        if (path->empty()) {
          continue;
        }
        const auto [other, first] = taken.emplace(*path, &item);
        if (!first) {
          throw UsageError(fmt::format(
              "{}: both {} and {} would write here. Give each scan its own in the columns work-dir "
              "and preview.",
              *path, other->second->scan, item.scan));
        }
      }
    }
  }

  const BatchSelection& selection_;
  const std::function<void(const std::string&)>& warn_;
  PathFilter filter_;
  OutputTemplate template_;
  std::string directory_;
  RemeshOptions base_;
  RowParser parser_;
  std::vector<BatchItem> items_;
  std::unordered_set<std::string> named_;  ///< absolute paths of scans
  std::vector<std::string> roots_;
  std::vector<std::string> empty_;
  std::map<std::string, std::shared_ptr<const ItemOptions>> rows_;
  std::map<std::vector<std::string>, std::shared_ptr<const ItemOptions>> by_words_;
};

void Selector::check_not_found_again() const {
  if (directory_.empty()) {
    return;
  }
  for (const std::string& root : roots_) {
    const std::string below = directory_ == "/" ? directory_ : directory_ + "/";
    if (root != directory_ && !root.starts_with(below)) {
      continue;
    }
    const std::string inside = root == directory_ ? "" : root.substr(below.size()) + "/";
    for (const BatchItem& item : items_) {
      for (const std::string& output : item_outputs(item)) {
        if (output.starts_with(inside) && filter_.takes(output.substr(inside.size()))) {
          throw UsageError(fmt::format(
              "{}/{}: the remesh would lie among the scans and be taken for one the next time. "
              "Choose another folder, e.g. -o {}/remeshes, or the scans with --include.",
              directory_, output, root));
        }
      }
    }
  }
}

}  // namespace

void add_selection_options(CLI::App& app, BatchSelection& s) {
  app.add_option("paths", s.paths,
                 "scans, folders (searched for .ply .obj .stl .off .drc, also .gz .zst), or "
                 "manifests (.csv, .jsonl): a row a scan with path, output and options")
      ->type_name("PATHS");
  app.add_option("-o,--output", s.directory, "folder of the remeshes, journal and report")
      ->type_name("DIR");
  app.add_option(
         "--include", s.include,
         "only scans with this name, or path if it has a /; *, ?, [a-z], ** for any folders")
      ->type_name("GLOB")
      ->expected(1)
      ->take_all()
      ->group("Selection");
  app.add_option("--exclude", s.exclude, "no scans and folders with this name or path")
      ->type_name("GLOB")
      ->expected(1)
      ->take_all()
      ->group("Selection");
  app.add_option("--name", s.name,
                 "outputs below DIR; {dir}/{stem} unless given; also {ext}, {root}, and {faces}, "
                 "{size}, {n} for several sizes")
      ->type_name("TEMPLATE")
      ->group("Selection");
  app.add_option("--format", s.format, "of the outputs; drc unless given")
      ->check(CLI::IsMember({"drc", "obj", "ply", "off"}))
      ->type_name("drc|obj|ply|off")
      ->group("Selection");
  add_scan_options(app, s.remesh);
}

std::vector<BatchItem> select_items(const BatchSelection& selection,
                                    const std::function<void(const std::string&)>& warn) {
  return Selector(selection, warn).run();
}

}  // namespace rattan
