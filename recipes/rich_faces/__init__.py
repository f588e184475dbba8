"""Simulated speakers whose faces move as no rig of the package does.

rich_face      one person's face: phones and sound in, vertices out (`RichFace`, `RichTake`)
talker_spread  how much real talkers differ, fitted by `recipes.talker_spread`
habits         how a person says each phone: targets, timing, reduction
prosody        head and brow with the stress of the speech
pauses         swallowing and breathing
face_places    smooth fields and regions on the mesh
own_shapes     a person's own version of each shape, and of shapes together
skin_and_jaw   the jaw's own path, skin that slides over jaw and cheeks
flesh          second-order response of cheeks, chin and under-jaw
lip_contact    lips that seal, flatten against each other and stay off the teeth
teeth          where the teeth are, for lips to stay off

A person is drawn from a seed. A field is a displacement of all vertices, and everything but contact
is a weighted sum of fields:

    phones, sound
      → habits, prosody, pauses    weights of shapes; contacts come last, as in the driver
      → own_shapes, skin_and_jaw   fields: own shapes, shapes together, jaw, slides, pauses
      → flesh                      each place's weights, filtered as a damped spring
      → lip_contact, teeth         the only part that is no sum of fields: lips and jaw bone
      → RichTake.vertices          (frame, vertex, 3), zero pose; head turns apart
"""
