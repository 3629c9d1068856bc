/* A law in C: linear elasticity in Green and Naghdi's rate (doc/developer/vumat.md). Compile it: make vumat FILE=input/vumat/elastic.c
 * constant: Young's modulus (Pa), Poisson's ratio */
void c_law(int points, int states, int constants, const double *constant, double time, double time_step,
           const double *density,         /* [points], half way through the step, kg/m3 */
           const double *strain,          /* [6][points], increment: xx yy zz xy yz xz of the tensor, in the frame of R */
           const double *spin,            /* [3][points], turn of the material beyond that of the frame */
           const double *deformation_old, /* [9][points], F: 11 22 33 12 23 31 21 32 13 */
           const double *deformation,     /* the same at the step's end */
           const double *stress_old,      /* [6][points], as strain, Pa */
           const double *state_old,       /* [states][points] */
           const double *energy_old,      /* [points], work of the stress per mass, J/kg */
           double *stress, double *state, double *energy, double *inelastic) /* to be set: as above; what of energy was dissipated */
{
   const double twice_shear = constant[0]/(1.0 + constant[1]);
   const double lame = twice_shear*constant[1]/(1.0 - 2.0*constant[1]);
   for (int p = 0; p < points; p++) {
      const double pressure = lame*(strain[p] + strain[points + p] + strain[2*points + p]);
      for (int c = 0; c < 6; c++)
         stress[c*points + p] = stress_old[c*points + p] + twice_shear*strain[c*points + p] + (c < 3 ? pressure : 0.0);
   }
}
