# brume_add_effect(name): one effect from the current folder's <name>.fs and, if it exists, <name>.cpp; or from
# the subfolder <name>/. The result is a folder <name>/ holding <name>.fs and <name>.so, which a
# folder of BRUME_EFFECT_PATH, or the install prefix, may hold.
set(BRUME_EFFECT_OUTPUT ${PROJECT_BINARY_DIR}/lib/brume/effects)

function(brume_add_effect name)
    set(from ${CMAKE_CURRENT_SOURCE_DIR})
    if(EXISTS ${from}/${name}/${name}.fs)
        set(from ${from}/${name})
    endif()
    file(MAKE_DIRECTORY ${BRUME_EFFECT_OUTPUT}/${name})
    # A link, so that an edited shader is what runs.
    file(CREATE_LINK ${from}/${name}.fs ${BRUME_EFFECT_OUTPUT}/${name}/${name}.fs SYMBOLIC)
    if(EXISTS ${from}/${name}.cpp)
        add_library(effect_${name} MODULE ${from}/${name}.cpp)
        target_link_libraries(effect_${name} PRIVATE brume::brume)
        target_include_directories(effect_${name} PRIVATE ${from}/..)
        # Unique symbols would keep a replaced plugin's old code alive.
        target_compile_options(effect_${name} PRIVATE -O3 -fno-gnu-unique -fvisibility=hidden)
        set_target_properties(effect_${name} PROPERTIES PREFIX "" OUTPUT_NAME ${name}
                              LIBRARY_OUTPUT_DIRECTORY ${BRUME_EFFECT_OUTPUT}/${name})
    endif()
endfunction()
