// The OpenGL 4.5 core functions that brume calls, loaded through the context's own getProcAddress: a process
// may hold contexts of several OpenGL libraries at once, whose functions must not be mixed.
#pragma once

#include <GL/glcorearb.h>

#include <functional>

namespace brume {

// clang-format off
// The name without `gl`, and as glcorearb.h spells it in PFNGL...PROC.
#define BRUME_GL_FUNCTIONS(X) \
    /* state */ \
    X(Enable, ENABLE) X(Disable, DISABLE) X(Enablei, ENABLEI) X(Disablei, DISABLEI) \
    X(IsEnabled, ISENABLED) X(GetError, GETERROR) X(GetIntegerv, GETINTEGERV) \
    X(GetInteger64v, GETINTEGER64V) X(GetFloatv, GETFLOATV) X(GetString, GETSTRING) \
    X(GetStringi, GETSTRINGI) X(Viewport, VIEWPORT) X(Scissor, SCISSOR) X(ClearColor, CLEARCOLOR) \
    X(Clear, CLEAR) X(ColorMask, COLORMASK) X(DepthMask, DEPTHMASK) X(DepthFunc, DEPTHFUNC) \
    X(DepthRange, DEPTHRANGE) X(ClipControl, CLIPCONTROL) X(CullFace, CULLFACE) X(FrontFace, FRONTFACE) \
    X(PolygonMode, POLYGONMODE) X(PolygonOffset, POLYGONOFFSET) X(BlendFunc, BLENDFUNC) \
    X(BlendFunci, BLENDFUNCI) X(BlendFuncSeparate, BLENDFUNCSEPARATE) \
    X(BlendFuncSeparatei, BLENDFUNCSEPARATEI) X(BlendEquation, BLENDEQUATION) \
    X(BlendEquationi, BLENDEQUATIONI) X(PixelStorei, PIXELSTOREI) X(Finish, FINISH) X(Flush, FLUSH) \
    X(MemoryBarrier, MEMORYBARRIER) \
    /* textures */ \
    X(GenTextures, GENTEXTURES) X(DeleteTextures, DELETETEXTURES) X(BindTexture, BINDTEXTURE) \
    X(CreateTextures, CREATETEXTURES) X(BindTextureUnit, BINDTEXTUREUNIT) X(ActiveTexture, ACTIVETEXTURE) \
    X(TextureStorage2D, TEXTURESTORAGE2D) X(TextureStorage3D, TEXTURESTORAGE3D) \
    X(TextureStorage2DMultisample, TEXTURESTORAGE2DMULTISAMPLE) X(TextureSubImage2D, TEXTURESUBIMAGE2D) \
    X(TextureSubImage3D, TEXTURESUBIMAGE3D) X(TextureParameteri, TEXTUREPARAMETERI) \
    X(TextureParameteriv, TEXTUREPARAMETERIV) X(TextureParameterfv, TEXTUREPARAMETERFV) \
    X(GenerateTextureMipmap, GENERATETEXTUREMIPMAP) X(GetTextureImage, GETTEXTUREIMAGE) \
    X(ClearTexImage, CLEARTEXIMAGE) X(CopyImageSubData, COPYIMAGESUBDATA) \
    X(BindImageTexture, BINDIMAGETEXTURE) X(TexImage2D, TEXIMAGE2D) X(TexParameteri, TEXPARAMETERI) \
    X(CreateSamplers, CREATESAMPLERS) X(DeleteSamplers, DELETESAMPLERS) X(BindSampler, BINDSAMPLER) \
    X(SamplerParameteri, SAMPLERPARAMETERI) X(SamplerParameterfv, SAMPLERPARAMETERFV) \
    /* framebuffers */ \
    X(GenFramebuffers, GENFRAMEBUFFERS) X(CreateFramebuffers, CREATEFRAMEBUFFERS) \
    X(DeleteFramebuffers, DELETEFRAMEBUFFERS) X(BindFramebuffer, BINDFRAMEBUFFER) \
    X(NamedFramebufferTexture, NAMEDFRAMEBUFFERTEXTURE) \
    X(NamedFramebufferTextureLayer, NAMEDFRAMEBUFFERTEXTURELAYER) \
    X(NamedFramebufferRenderbuffer, NAMEDFRAMEBUFFERRENDERBUFFER) \
    X(NamedFramebufferDrawBuffer, NAMEDFRAMEBUFFERDRAWBUFFER) \
    X(NamedFramebufferDrawBuffers, NAMEDFRAMEBUFFERDRAWBUFFERS) \
    X(NamedFramebufferReadBuffer, NAMEDFRAMEBUFFERREADBUFFER) \
    X(CheckNamedFramebufferStatus, CHECKNAMEDFRAMEBUFFERSTATUS) \
    X(ClearNamedFramebufferfv, CLEARNAMEDFRAMEBUFFERFV) \
    X(ClearNamedFramebufferuiv, CLEARNAMEDFRAMEBUFFERUIV) \
    X(ClearNamedFramebufferfi, CLEARNAMEDFRAMEBUFFERFI) X(BlitNamedFramebuffer, BLITNAMEDFRAMEBUFFER) \
    X(ReadBuffer, READBUFFER) X(ReadPixels, READPIXELS) X(CreateRenderbuffers, CREATERENDERBUFFERS) \
    X(DeleteRenderbuffers, DELETERENDERBUFFERS) X(NamedRenderbufferStorage, NAMEDRENDERBUFFERSTORAGE) \
    X(NamedRenderbufferStorageMultisample, NAMEDRENDERBUFFERSTORAGEMULTISAMPLE) \
    /* programs */ \
    X(CreateShader, CREATESHADER) X(ShaderSource, SHADERSOURCE) X(CompileShader, COMPILESHADER) \
    X(GetShaderiv, GETSHADERIV) X(GetShaderInfoLog, GETSHADERINFOLOG) X(DeleteShader, DELETESHADER) \
    X(CreateProgram, CREATEPROGRAM) X(AttachShader, ATTACHSHADER) X(DetachShader, DETACHSHADER) \
    X(LinkProgram, LINKPROGRAM) X(GetProgramiv, GETPROGRAMIV) X(GetProgramInfoLog, GETPROGRAMINFOLOG) \
    X(DeleteProgram, DELETEPROGRAM) X(UseProgram, USEPROGRAM) X(GetUniformLocation, GETUNIFORMLOCATION) \
    X(GetActiveUniform, GETACTIVEUNIFORM) X(GetUniformBlockIndex, GETUNIFORMBLOCKINDEX) \
    X(UniformBlockBinding, UNIFORMBLOCKBINDING) X(GetProgramResourceIndex, GETPROGRAMRESOURCEINDEX) \
    X(ShaderStorageBlockBinding, SHADERSTORAGEBLOCKBINDING) X(DispatchCompute, DISPATCHCOMPUTE) \
    X(ProgramUniform1i, PROGRAMUNIFORM1I) X(ProgramUniform1ui, PROGRAMUNIFORM1UI) \
    X(ProgramUniform1f, PROGRAMUNIFORM1F) X(ProgramUniform2i, PROGRAMUNIFORM2I) \
    X(ProgramUniform2f, PROGRAMUNIFORM2F) X(ProgramUniform3f, PROGRAMUNIFORM3F) \
    X(ProgramUniform4f, PROGRAMUNIFORM4F) X(ProgramUniform1fv, PROGRAMUNIFORM1FV) \
    X(ProgramUniform2fv, PROGRAMUNIFORM2FV) X(ProgramUniform3fv, PROGRAMUNIFORM3FV) \
    X(ProgramUniform4fv, PROGRAMUNIFORM4FV) X(ProgramUniformMatrix3fv, PROGRAMUNIFORMMATRIX3FV) \
    X(ProgramUniformMatrix4fv, PROGRAMUNIFORMMATRIX4FV) X(Uniform1i, UNIFORM1I) X(Uniform1f, UNIFORM1F) \
    X(Uniform3f, UNIFORM3F) X(Uniform4f, UNIFORM4F) X(UniformMatrix4fv, UNIFORMMATRIX4FV) \
    /* buffers and drawing */ \
    X(GenBuffers, GENBUFFERS) X(CreateBuffers, CREATEBUFFERS) X(DeleteBuffers, DELETEBUFFERS) \
    X(BindBuffer, BINDBUFFER) X(BindBufferBase, BINDBUFFERBASE) X(BindBufferRange, BINDBUFFERRANGE) \
    X(NamedBufferData, NAMEDBUFFERDATA) X(NamedBufferStorage, NAMEDBUFFERSTORAGE) \
    X(NamedBufferSubData, NAMEDBUFFERSUBDATA) X(GetNamedBufferSubData, GETNAMEDBUFFERSUBDATA) \
    X(MapNamedBufferRange, MAPNAMEDBUFFERRANGE) X(UnmapNamedBuffer, UNMAPNAMEDBUFFER) \
    X(GenVertexArrays, GENVERTEXARRAYS) X(CreateVertexArrays, CREATEVERTEXARRAYS) \
    X(DeleteVertexArrays, DELETEVERTEXARRAYS) X(BindVertexArray, BINDVERTEXARRAY) \
    X(VertexArrayVertexBuffer, VERTEXARRAYVERTEXBUFFER) \
    X(VertexArrayElementBuffer, VERTEXARRAYELEMENTBUFFER) \
    X(VertexArrayAttribFormat, VERTEXARRAYATTRIBFORMAT) \
    X(VertexArrayAttribIFormat, VERTEXARRAYATTRIBIFORMAT) \
    X(VertexArrayAttribBinding, VERTEXARRAYATTRIBBINDING) \
    X(VertexArrayBindingDivisor, VERTEXARRAYBINDINGDIVISOR) \
    X(EnableVertexArrayAttrib, ENABLEVERTEXARRAYATTRIB) X(DrawArrays, DRAWARRAYS) \
    X(DrawElements, DRAWELEMENTS) X(DrawArraysInstanced, DRAWARRAYSINSTANCED) \
    X(DrawElementsInstanced, DRAWELEMENTSINSTANCED) X(DrawElementsBaseVertex, DRAWELEMENTSBASEVERTEX) \
    X(MultiDrawArrays, MULTIDRAWARRAYS) \
    /* queries and synchronisation */ \
    X(CreateQueries, CREATEQUERIES) X(DeleteQueries, DELETEQUERIES) X(BeginQuery, BEGINQUERY) \
    X(EndQuery, ENDQUERY) X(QueryCounter, QUERYCOUNTER) X(GetQueryObjectiv, GETQUERYOBJECTIV) \
    X(GetQueryObjectui64v, GETQUERYOBJECTUI64V) X(FenceSync, FENCESYNC) X(ClientWaitSync, CLIENTWAITSYNC) \
    X(DeleteSync, DELETESYNC) \
    /* debugging */ \
    X(DebugMessageCallback, DEBUGMESSAGECALLBACK) X(DebugMessageControl, DEBUGMESSAGECONTROL) \
    X(ObjectLabel, OBJECTLABEL) X(PushDebugGroup, PUSHDEBUGGROUP) X(PopDebugGroup, POPDEBUGGROUP)
// clang-format on

/// One context's functions: `gl.DrawArrays(...)`. To call another one, add it to the list above.
struct GlFunctions {
#define BRUME_GL_MEMBER(name, upper) PFNGL##upper##PROC name = nullptr;
    BRUME_GL_FUNCTIONS(BRUME_GL_MEMBER)
#undef BRUME_GL_MEMBER
};

using GlProcAddress = void (*)();

/// Loads every function of the list. Throws Error (Usage) naming the first that is missing.
GlFunctions loadGlFunctions(const std::function<GlProcAddress(const char*)>& getProcAddress);

}  // namespace brume
