// SPDX-License-Identifier: MIT
#include "tools/rattan/remesh_arguments.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>

#include <fmt/format.h>

#include "engine/core/errors.h"
#include "jobs/size_list.h"
#include "tools/manual/option_table.h"
#include "tools/rattan/scan_arguments.h"

namespace rattan {

namespace {

namespace fs = std::filesystem;

void add_size_options(CLI::App& app, RemeshArguments& args) {
  CLI::Option* faces = app.add_option("--faces", args.faces,
                                      "faces of the remesh; a list like 50k,10k makes several");
  CLI::Option* edge =
      app.add_option("--edge-length", args.edge_length, "quad side, in the file's units");
  CLI::Option* ratio = app.add_option("--ratio", args.ratio,
                                      "faces per triangle of the repaired scan; default 0.05");
  faces->excludes(edge)->excludes(ratio)->type_name("N")->group("Size");
  edge->excludes(ratio)->type_name("LENGTH")->group("Size");
  ratio->type_name("R")->group("Size");
  app.add_option("--density", args.options.density,
                 "iso-lines per period, 1 to 16; default 1, or 4 with --pure-quads")
      ->check(CLI::Range(1, 16))
      ->type_name("M")
      ->group(more("Size"));
}

void add_crease_option(CLI::App& app, RemeshArguments& args) {
  app.add_option("--crease", args.crease,
                 "keep edges that turn by so much or more, 5 to 179, or off")
      ->check(CLI::Range(5.0, 179.0) | CLI::IsMember({"off"}))
      ->default_str("35")
      ->type_name("DEGREES")
      ->group("Method");
}

void add_output_options(CLI::App& app, RemeshArguments& args) {
  RemeshOptions& o = args.options;
  app.add_flag("--pure-quads", o.pure_quads, "only quads, no triangle")->group("Output");
  add_position_bits_option(app, o);
}

bool is_flag(const CLI::Option& option) {
  return option.get_items_expected_max() == 0;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string flag_value(const std::string& value, const std::string& column,
                       const std::string& place) {
  const std::string word = lower(value);
  if (word == "true" || word == "1" || word == "yes" || word == "on") {
    return "true";
  }
  if (word == "false" || word == "0" || word == "no" || word == "off") {
    return "false";
  }
  throw UsageError(
      fmt::format("{}: '{}' in the column {} is neither yes nor no. Write true or "
                  "false, or leave it empty.",
                  place, value, column));
}

std::string absolute(const std::string& path, const std::string& folder) {
  if (path.empty()) {
    return path;
  }
  return fs::absolute(fs::path(folder) / path).lexically_normal().string();
}

}  // namespace

RemeshArguments::RemeshArguments(const RemeshOptions& base)
    : options(base),
      smoothing(base.smoothing.value_or(0.0)),
      crease(base.crease > 0.0 ? fmt::format("{}", base.crease) : "off") {}

RemeshOptions RemeshArguments::resolve() const {
  RemeshOptions o = options;
  if (!faces.empty()) {
    o.size_kind = SizeKind::kFaces;
    o.sizes = parse_sizes(faces, "--faces", {1.0, 1e10});
  } else if (!edge_length.empty()) {
    o.size_kind = SizeKind::kEdgeLength;
    o.sizes = parse_sizes(edge_length, "--edge-length", {1e-30, 1e30});
  } else if (!ratio.empty()) {
    o.size_kind = SizeKind::kRatio;
    o.sizes = parse_sizes(ratio, "--ratio", {1e-9, 10.0});
  }
  o.crease = crease == "off" ? 0.0 : std::stod(crease);
  if (smoothing > 0.0) {
    o.smoothing = smoothing;
  }
  return o;
}

void add_scan_options(CLI::App& app, RemeshArguments& args) {
  add_size_options(app, args);
  add_repair_options(app, args.options);
  add_field_options(app, args.options, args.smoothing);
  add_crease_option(app, args);
  add_solver_options(app, args.options);
  add_output_options(app, args);
}

void add_run_options(CLI::App& app, RemeshArguments& args) {
  add_resource_options(app, args.options);
  app.add_option("--preview", args.options.preview, "write a PNG: scan, field, iso-lines, remesh")
      ->type_name("FILE")
      ->group("Run");
}

std::vector<std::string> option_words(const RemeshOptions& o) {
  const RemeshOptions usual;
  std::vector<std::string> words;
  const auto add = [&](const char* name, auto value) {
    words.emplace_back(name);
    words.push_back(fmt::format("{}", value));
  };
  const auto flag = [&](const char* name, bool on) {
    if (on) {
      words.emplace_back(name);
    }
  };
  if (o.size_kind != usual.size_kind || o.sizes != usual.sizes) {
    std::string sizes;
    for (const double size : o.sizes) {
      sizes += (sizes.empty() ? "" : ",") + size_text(size);
    }
    const char* names[] = {"--faces", "--edge-length", "--ratio"};
    add(names[static_cast<int>(o.size_kind)], sizes);
  }
  if (o.density != usual.density) {
    add("--density", o.density);
  }
  flag("--merge-vertices", o.merge_vertices);
  if (o.drop_components != usual.drop_components) {
    add("--drop-components", o.drop_components);
  }
  if (o.fill_holes != usual.fill_holes) {
    add("--fill-holes", o.fill_holes);
  }
  if (!o.field.empty()) {
    add("--field", o.field);
  }
  if (o.symmetry != usual.symmetry) {
    add("--symmetry", o.symmetry);
  }
  if (o.smoothing) {
    add("--smoothing", *o.smoothing);
  }
  flag("--curl-correction", o.curl_correction);
  if (o.crease != usual.crease) {
    add("--crease", o.crease > 0.0 ? fmt::format("{}", o.crease) : "off");
  }
  if (o.energy != usual.energy) {
    add("--energy", o.energy == Energy::kEdge ? "edge" : "triangle");
  }
  if (o.solver != usual.solver) {
    add("--solver", o.solver == SolverKind::kNested ? "nested" : "reference");
  }
  if (o.newton_steps != usual.newton_steps) {
    add("--newton-steps", o.newton_steps);
  }
  flag("--pure-quads", o.pure_quads);
  if (o.position_bits != usual.position_bits) {
    add("--position-bits", o.position_bits);
  }
  if (o.memory != usual.memory) {
    add("--memory", o.memory);
  }
  if (o.threads != usual.threads) {
    add("--threads", o.threads);
  }
  if (!o.work_dir.empty()) {
    add("--work-dir", o.work_dir);
  }
  flag("--keep-work", o.keep_work);
  if (!o.preview.empty()) {
    add("--preview", o.preview);
  }
  return words;
}

void make_absolute(RemeshOptions& options, const std::string& folder) {
  options.field = absolute(options.field, folder);
  options.work_dir = absolute(options.work_dir, folder);
  options.preview = absolute(options.preview, folder);
}

RowParser::RowParser() : app_(std::make_unique<CLI::App>()) {
  app_->set_help_flag();
  add_scan_options(*app_, args_);
  add_run_options(*app_, args_);
  for (const CLI::Option* option : app_->get_options()) {
    columns_.push_back(option->get_lnames().front());
  }
}

RowParser::~RowParser() = default;

RemeshOptions RowParser::parse(const RemeshOptions& base,
                               const std::vector<std::pair<std::string, std::string>>& values,
                               const std::string& folder, const std::string& place) {
  args_ = RemeshArguments(base);
  std::vector<std::string> words;
  for (const auto& [column, value] : values) {
    if (value.empty()) {
      continue;
    }
    const CLI::Option* option = app_->get_option_no_throw("--" + column);
    if (option == nullptr) {
      throw UsageError(
          fmt::format("{}: there is no option --{} that a row could give. Rows give: {}.", place,
                      column, fmt::join(columns_, ", ")));
    }
    words.push_back("--" + column + "=" +
                    (is_flag(*option) ? flag_value(value, column, place) : value));
  }
  try {
    std::reverse(words.begin(), words.end());  // CLI11 takes them from the back
    app_->parse(words);
    RemeshOptions options = args_.resolve();
    make_absolute(options, folder);
    return options;
  } catch (const CLI::ParseError& e) {
    throw UsageError(fmt::format("{}: {}. Correct this row.", place, e.what()));
  } catch (const UsageError& e) {
    throw UsageError(place + ": " + e.what());
  }
}

}  // namespace rattan
