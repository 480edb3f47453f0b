// SPDX-License-Identifier: MIT
// A stroke font: clean at any size, and no font file is needed.

#include <algorithm>
#include <array>

#include "io/picture/image.h"

namespace rattan {
namespace {

/// Polylines of "xy" pairs; x from 0 to 4, y from 0 (descender) over 2 (baseline) and 6 (lower
/// case) to 8 (capitals). A lone pair is a dot.
constexpr std::array<std::string_view, 95> kGlyphs = {
    "",                                    // space
    "2824 22",                             // !
    "1816 3836",                           // "
    "1822 3832 0646 0444",                 // #
    "4737170616364433130322 2822",         // $
    "0248 0817 4233",                      // %
    "42071838270504122244",                // &
    "2826",                                // '
    "38262432",                            // (
    "18262412",                            // )
    "2723 0644 4604",                      // *
    "2723 0545",                           // +
    "2311",                                // ,
    "0545",                                // -
    "22",                                  // .
    "0248",                                // /
    "183847433212030718",                  // 0
    "062822 1232",                         // 1
    "07183847450242",                      // 2
    "071838474635 15354443321203",         // 3
    "32380444",                            // 4
    "48080525354443321203",                // 5
    "4738180703123243443515 0504",         // 6
    "084822",                              // 7
    "1838474635150403123243443515060718",  // 8
    "031232434738180706153546",            // 9
    "26 23",                               // :
    "26 2311",                             // ;
    "470543",                              // <
    "0646 0444",                           // =
    "074503",                              // >
    "071838474625 24 22",                  // ?
    "4233242636433313040718384745",        // @
    "022842 0444",                         // A
    "02083847463505 35444332 02",          // B
    "4738180703123243",                    // C
    "02082847432202",                      // D
    "48080242 0535",                       // E
    "480802 0535",                         // F
    "47381807031232434525",                // G
    "0208 4248 0545",                      // H
    "1838 2822 1232",                      // I
    "384833221203",                        // J
    "0208 4804 1542",                      // K
    "080242",                              // L
    "0208254842",                          // M
    "02084248",                            // N
    "183847433212030718",                  // O
    "020838474635 3505",                   // P
    "183847433212030718 2442",             // Q
    "020838474635053542",                  // R
    "473818070615354443321203",            // S
    "0848 2822",                           // T
    "080312324348",                        // U
    "082248",                              // V
    "0812253248",                          // W
    "0248 0842",                           // X
    "082548 2522",                         // Y
    "08480242",                            // Z
    "38282232",                            // [
    "0842",                                // backslash
    "18282212",                            // ]
    "062846",                              // ^
    "0141",                                // _
    "1827",                                // `
    "06163645424212030414 1444",           // a
    "0802 0516364543321203",               // b
    "4536160503123243",                    // c
    "4842 4536160503123243",               // d
    "04444536160503123243",                // e
    "47382822 0636",                       // f
    "4536160503123243 4641301001",         // g
    "0802 0516364542",                     // h
    "2622 28",                             // i
    "3631201001 38",                       // j
    "0802 4604 1542",                      // k
    "282332",                              // l
    "0602 05162522 25364542",              // m
    "0602 0516364542",                     // n
    "163645433212030516",                  // o
    "0600 0516364543321203",               // p
    "4640 4536160503123243",               // q
    "0602 04163646",                       // r
    "45361605143443321203",                // s
    "28233242 0636",                       // t
    "0603123243 4642",                     // u
    "062246",                              // v
    "0612243246",                          // w
    "0246 0642",                           // x
    "0622 462010",                         // y
    "06460242",                            // z
    "38272615242332",                      // {
    "2820",                                // |
    "18272635242312",                      // }
    "05162536 45",                         // ~
};

constexpr float kAdvance = 6.0F;  // grid units, of which six make the height of a capital

}  // namespace

float text_width(std::string_view text, float height) {
  return static_cast<float>(text.size()) * kAdvance * height / 6.0F * 0.92F;
}

void draw_text(Image& image, std::string_view text, Point2 baseline, float height,
               const Rgb& colour) {
  const float unit = height / 6.0F;
  const float width = std::max(1.1F, 0.13F * height);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto code = static_cast<unsigned char>(text[i]);
    const std::string_view glyph =
        code >= 32 && code < 127 ? kGlyphs[code - 32U] : std::string_view("0208484202");
    const float left = baseline.x + static_cast<float>(i) * kAdvance * unit * 0.92F;
    Point2 last;
    bool down = false;
    bool drawn = false;
    const auto lift = [&] {
      if (down && !drawn) {
        draw_stroke(image, last, last, width * 1.3F, colour);
      }
      down = drawn = false;
    };
    for (std::size_t k = 0; k < glyph.size();) {
      if (glyph[k] == ' ' || k + 1 == glyph.size()) {
        lift();
        ++k;
        continue;
      }
      const Point2 p{left + static_cast<float>(glyph[k] - '0') * unit * 0.85F,
                     baseline.y - (static_cast<float>(glyph[k + 1] - '0') - 2.0F) * unit};
      if (down) {
        draw_stroke(image, last, p, width, colour);
        drawn = true;
      }
      last = p;
      down = true;
      k += 2;
    }
    lift();
  }
}

}  // namespace rattan
