#include "frame/exr_attributes.hpp"

#include <ImfDoubleAttribute.h>
#include <ImfHeader.h>
#include <ImfMatrixAttribute.h>
#include <ImfStringAttribute.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "error.hpp"
#include "frame/camera_limits.hpp"
#include "strict_json.hpp"

namespace brume {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

struct NamedDouble {
    const char* name;
    double Camera::*field;
};
constexpr NamedDouble intrinsics[] = {
    {"brumeFx", &Camera::fx}, {"brumeFy", &Camera::fy}, {"brumeCx", &Camera::cx}, {"brumeCy", &Camera::cy}};

std::optional<Camera> getCamera(const json& attributes, const std::string& path) {
    Camera camera;
    for (const NamedDouble& n : intrinsics) {
        const auto value = attributes.find(n.name);
        if (value == attributes.end() || !value->is_number()) return std::nullopt;
        camera.*n.field = value->get<double>();
    }
    const auto matrix = attributes.find("brumeWorldFromCamera");
    if (matrix == attributes.end() || !matrix->is_array() || matrix->size() != 16) return std::nullopt;
    for (int k = 0; k < 16; ++k) camera.worldFromCamera.val[k] = (*matrix)[k].get<double>();
    if (const std::string problem = problemOf(camera); !problem.empty())
        failIo(path, ": its camera (brumeFx, ...): ", problem);
    return camera;
}

std::string textOf(const json& attributes, const char* name) {
    const auto attribute = attributes.find(name);
    return attribute != attributes.end() && attribute->is_string() ? attribute->get<std::string>() : "";
}

}  // namespace

ExrStatements getStatements(const json& attributes, const std::string& path) {
    ExrStatements stated;
    stated.camera = getCamera(attributes, path);
    if (const auto time = attributes.find("brumeTime"); time != attributes.end() && time->is_number())
        stated.time = time->get<double>();
    if (stated.time && !std::isfinite(*stated.time)) failIo(path, ": its time (brumeTime) is ", *stated.time);
    const std::string encoding = textOf(attributes, "brumeDepthEncoding"),
                      sidecar = textOf(attributes, "brumeSidecar");
    try {
        if (!encoding.empty()) stated.encoding = parseDepthEncoding(encoding);
        if (!sidecar.empty()) {
            json extras = parseJson(sidecar);
            if (!extras.is_object()) failIo("must hold an object");
            const fs::path folder = fs::path(path).parent_path() / extras.value("sidecar_folder", "");
            extras["sidecar_folder"] = folder.lexically_normal().string();
            stated.extras = std::make_shared<const json>(std::move(extras));
        }
    } catch (const Error& e) {
        failIo(path, ": attribute ",
               stated.encoding || encoding.empty() ? "brumeSidecar" : "brumeDepthEncoding", ": ", e.what());
    } catch (const json::exception& e) {
        failIo(path, ": attribute brumeSidecar: ", reasonOf(e));
    }
    return stated;
}

void putStatements(Imf::Header& header, const ExrStatements& statements, const std::string& folder) {
    if (statements.camera) {
        const Camera& camera = *statements.camera;
        for (const NamedDouble& n : intrinsics) header.insert(n.name, Imf::DoubleAttribute(camera.*n.field));
        Imath::M44d matrix;
        for (int row = 0; row < 4; ++row)
            for (int column = 0; column < 4; ++column)
                matrix[row][column] = camera.worldFromCamera(row, column);
        header.insert("brumeWorldFromCamera", Imf::M44dAttribute(matrix));
    }
    // What brume writes is metres: nobody need guess.
    if (statements.encoding) header.insert("brumeDepthEncoding", Imf::StringAttribute("linear"));
    if (statements.time) header.insert("brumeTime", Imf::DoubleAttribute(*statements.time));
    if (!statements.extras) return;
    json extras = *statements.extras;
    // The file says these itself.
    for (const char* key : {"depth", "camera", "color", "time"}) extras.erase(key);
    const std::string from = extras.value("sidecar_folder", "");
    extras.erase("sidecar_folder");
    if (extras.empty()) return;
    const fs::path relative = fs::absolute(from.empty() ? "." : from)
                                  .lexically_relative(fs::absolute(folder.empty() ? "." : folder));
    extras["sidecar_folder"] = relative.string();
    header.insert("brumeSidecar", Imf::StringAttribute(shownJson(extras)));
}

}  // namespace brume
