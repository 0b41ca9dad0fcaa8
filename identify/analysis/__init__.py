"""What logs tell without a diagnosis: a first model, friction by speed, the force of the cable.

And the dynamic part of a friction from open-loop logs.
"""
