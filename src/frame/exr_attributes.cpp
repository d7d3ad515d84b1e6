#include "frame/exr_attributes.hpp"

#include <ImfDoubleAttribute.h>
#include <ImfHeader.h>
#include <ImfMatrixAttribute.h>

namespace brume {

namespace {

struct NamedDouble {
    const char* name;
    double Camera::*field;
};
constexpr NamedDouble intrinsics[] = {
    {"brumeFx", &Camera::fx}, {"brumeFy", &Camera::fy}, {"brumeCx", &Camera::cx}, {"brumeCy", &Camera::cy}};

}  // namespace

void putCamera(Imf::Header& header, const Camera& camera, double time) {
    for (const NamedDouble& n : intrinsics) header.insert(n.name, Imf::DoubleAttribute(camera.*n.field));
    Imath::M44d matrix;
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) matrix[row][column] = camera.worldFromCamera(row, column);
    header.insert("brumeWorldFromCamera", Imf::M44dAttribute(matrix));
    header.insert("brumeTime", Imf::DoubleAttribute(time));
}

std::optional<ExrCamera> getCamera(const Imf::Header& header) {
    ExrCamera found;
    for (const NamedDouble& n : intrinsics) {
        const auto* value = header.findTypedAttribute<Imf::DoubleAttribute>(n.name);
        if (!value) return std::nullopt;
        found.camera.*n.field = value->value();
    }
    const auto* matrix = header.findTypedAttribute<Imf::M44dAttribute>("brumeWorldFromCamera");
    if (!matrix) return std::nullopt;
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            found.camera.worldFromCamera(row, column) = matrix->value()[row][column];
    if (const auto* time = header.findTypedAttribute<Imf::DoubleAttribute>("brumeTime"))
        found.time = time->value();
    return found;
}

}  // namespace brume
