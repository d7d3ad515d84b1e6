// brume_contact_sheet: pictures with captions on one sheet.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <vector>

namespace {

using OIIO::ImageBuf;
using OIIO::ROI;
namespace algo = OIIO::ImageBufAlgo;

constexpr int margin = 28, gutter = 14, titleHeight = 64, headingHeight = 50, captionHeight = 34;
const float paper[3] = {.055f, .06f, .068f}, bright[3] = {.93f, .94f, .95f}, quiet[3] = {.62f, .65f, .69f};
const char* const plainFont = "DejaVuSans";
const char* const boldFont = "DejaVuSans-Bold";

struct Picture {
    std::string caption, file;
};
struct Section {
    std::string heading;
    std::vector<Picture> pictures;
};

std::vector<Section> parseItems(const std::vector<std::string>& items) {
    std::vector<Section> sections;
    for (const std::string& item : items) {
        if (item.rfind("# ", 0) == 0) {
            sections.push_back({item.substr(2), {}});
            continue;
        }
        const size_t equals = item.find('=');
        if (sections.empty()) sections.push_back({});
        if (equals == std::string::npos)
            sections.back().pictures.push_back({std::filesystem::path(item).stem().string(), item});
        else
            sections.back().pictures.push_back({item.substr(0, equals), item.substr(equals + 1)});
    }
    return sections;
}

void write(ImageBuf& sheet, int x, int y, const std::string& text, int size, const char* font,
           const float* color) {
    if (!algo::render_text(sheet, x, y, text, size, font, OIIO::cspan<float>(color, 3)))
        throw std::runtime_error("no text can be drawn: " + sheet.geterror() + "; install fonts-dejavu-core");
}

// The picture fitted into a cell's width, as three display-encoded channels.
ImageBuf cell(const Picture& picture, int width) {
    ImageBuf image(picture.file);
    if (!image.read(0, 0, true, OIIO::TypeFloat))
        throw std::runtime_error(picture.file + ": cannot be read: " + image.geterror());
    const int order[3] = {0, image.nchannels() > 1 ? 1 : 0, image.nchannels() > 2 ? 2 : 0};
    image = algo::channels(image, 3, order);
    const OIIO::ImageSpec& spec = image.spec();
    const int height = std::max(1, int(std::lround(double(width) * spec.height / spec.width)));
    ImageBuf fitted = algo::resize(image, "lanczos3", 0, ROI(0, width, 0, height, 0, 1, 0, 3));
    return algo::clamp(fitted, 0.f, 1.f);
}

void makeSheet(const std::vector<Section>& sections, const std::string& title, int columns, int width,
               const std::string& out) {
    struct Placed {
        ImageBuf image;
        int x, y;
        const Picture* picture;
    };
    std::vector<Placed> placed;
    std::vector<std::pair<int, const std::string*>> headings;
    int y = title.empty() ? margin : margin + titleHeight;
    for (const Section& section : sections) {
        if (!section.heading.empty()) {
            headings.push_back({y, &section.heading});
            y += headingHeight;
        }
        int rowHeight = 0, column = 0;
        for (const Picture& picture : section.pictures) {
            if (column == columns) {
                y += rowHeight + captionHeight;
                rowHeight = column = 0;
            }
            placed.push_back({cell(picture, width), margin + column * (width + gutter), y, &picture});
            rowHeight = std::max(rowHeight, placed.back().image.spec().height);
            column++;
        }
        y += rowHeight + captionHeight + gutter;
    }
    const int sheetWidth = 2 * margin + columns * width + (columns - 1) * gutter,
              sheetHeight = y + margin - gutter;
    ImageBuf sheet(OIIO::ImageSpec(sheetWidth, sheetHeight, 3, OIIO::TypeFloat));
    algo::fill(sheet, paper);
    if (!title.empty()) write(sheet, margin, margin + 36, title, 34, boldFont, bright);
    for (const auto& [top, heading] : headings)
        write(sheet, margin, top + 30, *heading, 23, boldFont, bright);
    for (const Placed& place : placed) {
        algo::paste(sheet, place.x, place.y, 0, 0, place.image);
        write(sheet, place.x + 2, place.y + place.image.spec().height + 23, place.picture->caption, 17,
              plainFont, quiet);
    }
    sheet.specmod().attribute("CompressionQuality", 92);
    if (!sheet.write(out, OIIO::TypeUInt8))
        throw std::runtime_error(out + ": cannot be written: " + sheet.geterror());
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"Puts pictures with captions on one sheet."};
    std::string out, title;
    int columns = 3, width = 480;
    std::vector<std::string> items;
    app.add_option("items", items,
                   "CAPTION=FILE, FILE (its name is the caption), or '# HEADING' before a group")
        ->required();
    app.add_option("-o,--output", out, ".png or .jpg")->required();
    app.add_option("--title", title);
    app.add_option("--columns", columns)->check(CLI::Range(1, 64))->capture_default_str();
    app.add_option("--width", width, "px of one picture")->check(CLI::Range(16, 8192))->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    try {
        makeSheet(parseItems(items), title, columns, width, out);
    } catch (const std::exception& error) {
        std::cerr << "brume_contact_sheet: " << error.what() << '\n';
        return 3;
    }
    return 0;
}
