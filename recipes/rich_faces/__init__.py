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
"""
