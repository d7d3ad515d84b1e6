#include "gl/rows_buffer.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace brume {

const char* glslType(ParameterType type) {
    switch (type) {
        case ParameterType::Event:
        case ParameterType::Bool:
            return "bool";
        case ParameterType::Long:
            return "int";
        case ParameterType::Float:
            return "float";
        case ParameterType::Point2D:
            return "vec2";
        case ParameterType::Point3D:
            return "vec3";
        case ParameterType::Color:
            return "vec4";
        default:
            return "sampler2D";
    }
}

RowLayout rowLayout(const std::vector<Parameter>& fields) {
    auto roundUp = [](size_t value, size_t to) { return (value + to - 1) / to * to; };
    RowLayout layout;
    size_t end = 0, largest = 4;
    for (const Parameter& field : fields) {
        const size_t count = componentCount(field.type);
        const size_t alignment = count == 3 ? 16 : 4 * count;  // a vec3 aligns like a vec4
        layout.offsets.push_back(roundUp(end, alignment));
        end = layout.offsets.back() + 4 * count;
        largest = std::max(largest, alignment);
    }
    layout.stride = roundUp(end, largest);
    return layout;
}

std::vector<std::byte> packRows(const Parameter& list, const ParameterValue& value) {
    const RowLayout layout = rowLayout(list.fields);
    std::vector<std::byte> bytes(layout.stride * std::max<size_t>(value.rows.size(), 1));
    for (size_t row = 0; row < value.rows.size(); row++)
        for (size_t k = 0; k < list.fields.size(); k++) {
            const Parameter& field = list.fields[k];
            const std::vector<double>& numbers = value.rows[row].at(field.name).numbers;
            std::byte* to = bytes.data() + row * layout.stride + layout.offsets[k];
            for (size_t n = 0; n < numbers.size(); n++) {
                const float real = float(numbers[n]);
                const int32_t whole = int32_t(numbers[n]);
                const bool isReal = field.type != ParameterType::Long && field.type != ParameterType::Bool &&
                                    field.type != ParameterType::Event;
                std::memcpy(to + 4 * n, isReal ? static_cast<const void*>(&real) : &whole, 4);
            }
        }
    return bytes;
}

}  // namespace brume
