// SPDX-License-Identifier: MIT
#include <charconv>
#include <map>
#include <memory>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"
#include "jobs/render_job.h"
#include "tools/rattan/commands.h"

namespace rattan {

namespace {

constexpr int kLeastPixels = 16;
constexpr int kMostPixels = 8192;

struct Arguments {
  PictureOptions options;
  std::string size = "1200";
  std::string view;
  std::string up;
};

/// The two numbers of "A<separator>B"; false where there are not exactly two.
template <class Number>
bool two_numbers(const std::string& text, char separator, Number& a, Number& b) {
  const char* const end = text.data() + text.size();
  const auto [middle, first] = std::from_chars(text.data(), end, a);
  if (first != std::errc() || middle == end || *middle != separator) {
    return false;
  }
  const auto [last, second] = std::from_chars(middle + 1, end, b);
  return second == std::errc() && last == end;
}

void parse_size(const std::string& text, PictureOptions& options) {
  const char* const end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data(), end, options.width);
  options.height = options.width;
  const bool square = error == std::errc() && last == end;
  if ((!square && !two_numbers(text, 'x', options.width, options.height)) ||
      std::min(options.width, options.height) < kLeastPixels ||
      std::max(options.width, options.height) > kMostPixels) {
    throw UsageError("--size " + text + ": give pixels as W or WxH, each from " +
                     std::to_string(kLeastPixels) + " to " + std::to_string(kMostPixels) + ".");
  }
}

void parse_view(const std::string& text, ViewWish& view) {
  struct Degrees {
    double azimuth, elevation;
  };
  // Straight down there is no way up.
  static const std::map<std::string, Degrees> kNamed{
      {"front", {0.0, 0.0}},  {"back", {180.0, 0.0}}, {"right", {90.0, 0.0}},
      {"left", {-90.0, 0.0}}, {"top", {0.0, 89.9}},   {"bottom", {0.0, -89.9}}};
  Degrees d{};
  if (const auto named = kNamed.find(text); named != kNamed.end()) {
    d = named->second;
  } else if (!two_numbers(text, ',', d.azimuth, d.elevation) || !(d.azimuth >= -360.0) ||
             !(d.azimuth <= 360.0) || !(d.elevation >= -89.9) || !(d.elevation <= 89.9)) {
    throw UsageError("--view " + text +
                     ": give front, back, left, right, top, bottom, or AZIMUTH,ELEVATION in "
                     "degrees, elevation from -89.9 to 89.9.");
  }
  view.azimuth = d.azimuth * exact::kPi / 180.0;
  view.elevation = d.elevation * exact::kPi / 180.0;
}

int run(Arguments& args) {
  parse_size(args.size, args.options);
  if (!args.view.empty()) {
    parse_view(args.view, args.options.view);
  }
  if (!args.up.empty()) {
    args.options.view.up_axis = args.up[0] - 'x';
  }
  render_picture(args.options);
  return 0;
}

}  // namespace

void add_render_command(CLI::App& app, Action& action) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "render", "Draw a mesh, a scan, or the steps of a kept work directory (PNG).");
  command->add_option("path", args->options.path, "mesh or scan file, or a work directory")
      ->required();
  command->add_option("-o,--output", args->options.output, "PNG to write")
      ->type_name("FILE")
      ->required();
  command
      ->add_option("--size", args->size,
                   "pixels, W or WxH; of a work directory's picture those of one panel at most")
      ->type_name("WxH")
      ->capture_default_str();
  command
      ->add_option("--view", args->view,
                   "front, back, left, right, top, bottom, or AZIMUTH,ELEVATION in degrees; "
                   "default three-quarter from the front")
      ->type_name("VIEW");
  command->add_option("--up", args->up, "axis that points up; default guessed from the shape")
      ->check(CLI::IsMember({"x", "y", "z"}));
  command->add_option("--edges", args->options.edges, "default fit: where there is room for them")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, EdgeDrawing>{{"fit", EdgeDrawing::kFit},
                                             {"always", EdgeDrawing::kAlways},
                                             {"never", EdgeDrawing::kNever}}));
  auto* texture =
      command
          ->add_option("--texture", args->options.texture,
                       "by the file's texture coordinates: checker, or a PNG or JPEG picture")
          ->type_name("checker|FILE");
  command
      ->add_option("--checks", args->options.checks,
                   "fields of the checkerboard a texture unit; default about eight a chart")
      ->check(CLI::Range(1e-6, 1e6))
      ->type_name("N")
      ->needs(texture);
  command->callback([args, &action] { action = [args] { return run(*args); }; });
}

}  // namespace rattan
