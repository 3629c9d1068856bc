"""From measured load-depth curves to the material, with intervals (doc/user/identification.md).

tips         tools of experiments, and the depth that they have been worn or rounded by
measured     readers of measured curves and of numbers that were derived from them
laws         stress over plastic strain, and the numbers that describe it
forward      the scene of a tip in a material, and what is kept of its run
cache        runs that are kept by their scene, so that none is made twice; those that come with the package
surrogate    polynomials through the runs, and how far they are off
fit          parameters, nuisances and their covariance; profiles of the likelihood
words        what the data determine and what they do not, in sentences; the next experiment
page         the page
general      any scene with @name@ in it, and any column of its histories
"""
