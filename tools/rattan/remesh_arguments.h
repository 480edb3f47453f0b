// SPDX-License-Identifier: MIT
#pragma once

// The options of `rattan remesh` on a command line and in a manifest, defined once for all commands
// that take them.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "jobs/remesh_options.h"

namespace rattan {

/// What the parser fills. Starts from `options`: what isn't given stays as it is there.
struct RemeshArguments {
  RemeshArguments() = default;
  explicit RemeshArguments(const RemeshOptions& base);

  RemeshOptions options;
  std::string faces;  ///< empty, like the next two, unless given
  std::string edge_length;
  std::string ratio;
  double smoothing = 0.0;  ///< 0: not given
  std::string crease = "35";

  /// `options` with the rest put in. Throws UsageError for sizes that are none.
  RemeshOptions resolve() const;
};

/// Options that say what becomes of a scan, in the groups Size, Scan, Method and Output: of
/// `remesh`, of `batch` and `slurm` (there for every scan), and columns of a manifest.
void add_scan_options(CLI::App& app, RemeshArguments& args);

/// Options of one run over one scan, group Run: of `remesh`, and columns of a manifest. For a batch
/// as a whole they would mean something else: memory and threads of all runs together.
void add_run_options(CLI::App& app, RemeshArguments& args);

/// The options as words that the parser takes, in a fixed order, without those that are as in a
/// default RemeshOptions: of add_scan_options() and add_run_options() alone. Parsing them gives the
/// same options.
std::vector<std::string> option_words(const RemeshOptions& options);

/// Relative paths in the options made absolute, as seen from `folder`.
void make_absolute(RemeshOptions& options, const std::string& folder);

/// Turns a row of a manifest into options. Made once for many rows.
class RowParser {
 public:
  RowParser();
  ~RowParser();
  RowParser(const RowParser&) = delete;
  RowParser& operator=(const RowParser&) = delete;

  /// Names of columns, in the order of option_words().
  const std::vector<std::string>& columns() const { return columns_; }

  /// `base` with what the row gives (column and value; an empty value gives nothing). Relative
  /// paths are made absolute as seen from `folder`. Throws UsageError that begins with `place`.
  RemeshOptions parse(const RemeshOptions& base,
                      const std::vector<std::pair<std::string, std::string>>& values,
                      const std::string& folder, const std::string& place);

 private:
  RemeshArguments args_;
  std::unique_ptr<CLI::App> app_;
  std::vector<std::string> columns_;
};

}  // namespace rattan
