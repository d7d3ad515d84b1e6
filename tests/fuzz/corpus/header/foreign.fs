/*{"ISFVSN":"2","INPUTS":[{"NAME":"inputImage","TYPE":"image"},{"NAME":"level","TYPE":"float","DEFAULT":0.5,"MIN":0,"MAX":1,},{"NAME":"flash","TYPE":"event"},{"NAME":"mode","TYPE":"long","VALUES":[0,1],"LABELS":["a","b"],"DEFAULT":0}],"PASSES":[{"TARGET":"small","WIDTH":"floor($WIDTH/2.0)","HEIGHT":"HEIGHT/2","PERSISTENT":true,"FLOAT":1},{}],"IMPORTED":{"img":{"PATH":"a.png"}}}*/
varying vec2 left;
uniform vec2 RENDERSIZE;
const float aspect = RENDERSIZE.x/RENDERSIZE.y;
void main(){ vec4 sample=texture2D(small,vv_FragNormCoord); gl_FragColor = PASSINDEX==0 ? IMG_THIS_PIXEL(inputImage) : sample; }