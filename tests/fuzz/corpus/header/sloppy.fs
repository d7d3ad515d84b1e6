/*{ ISFVSN: '2', CATEGORIES: [ 'x' 'y', ], // c
 INPUTS: [ {NAME: level; TYPE: float, DEFAULT: .5f, MAX: +1.} }*/
#ifdef GL_ES
precision mediump float;
#endif
void main(void){gl_FragColor=vec4(1.);}